### Words of the charts on all pages.

chart-nothing = No values in this span
chart-local_time = Local time ({ $zone })
chart-earlier = Earlier
chart-later = Later
chart-zoom_in = Zoom in
chart-zoom_out = Zoom out
chart-all = All
chart-show_all = Show the whole span
chart-and_others = further marks: { $count }
