### Remarks on what machines ship

remark-part_kept_apart = The lake has other content in its place: it is kept apart, below apart/. Was the history begun anew, or have two machines one name?
remark-part_sent_again = The lake's copy was cut and is replaced
remark-part_unreadable = The file is damaged and was not sent; thermaxis history check says more
