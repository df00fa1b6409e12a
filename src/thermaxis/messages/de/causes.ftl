### Warum eine Maschine einer Flotte genannt wird, und was zu tun ist

cause-sensor_frozen = Sensor steht still
cause-sensors_swapped = Sensoren vertauscht
cause-sensor_offset = Sensor liegt daneben
cause-gain = antwortet stärker oder schwächer auf Wärme
cause-time_constant = antwortet schneller oder langsamer auf Wärme
cause-drift = bewegt sich ohne Wärme
cause-unknown = Modell passt schlechter

fault-sensor_frozen = { NAME($name) } gibt immer denselben Wert, während andere Sensoren sich bewegen.
    .remedy = Den Sensor, sein Kabel und seine Baugruppe ansehen.
fault-sensors_swapped = { NAME($name) } scheinen vertauscht: andersherum erklären sie, was die Antastungen zeigen.
    .remedy = Die Verdrahtung und die Zuordnung der Sensoren prüfen.
fault-sensor_offset = In Ruhe liegt { NAME($name) } um { SIGNED($departure_k, decimals: 1) } K anders zu seinen Nachbarn als zuvor.
    .remedy = Den Sensor mit einem anderen vergleichen und nachsehen, ob er noch an der Maschine sitzt.
fault-gain = Die Verlagerung durch { NAME($name) } weicht um { SIGNED($departure_percent, decimals: 0) } % vom Modell ab.
    .remedy = Nachsehen, was sich geändert hat: Kühlung, Spannung, Lager. Ist die Maschine in Ordnung, ein vorgeschlagenes Modell annehmen.
fault-time_constant = Die Zeitkonstante von { NAME($name) } weicht um { SIGNED($departure_percent, decimals: 0) } % vom Modell ab.
    .remedy = Nachsehen, was sich geändert hat: Kühlung, Lüfter, Abdeckungen. Ist die Maschine in Ordnung, ein vorgeschlagenes Modell annehmen.
fault-drift = Der Werkzeugpunkt hat sich ohne Wärme um { SIGNED($departure_um, decimals: 1) } µm bewegt.
    .remedy = Wurde ein Bezug neu gesetzt? Sonst nach Verschleiß, einer Kollision oder einem losen Taster suchen; die Achse messen.
fault-unknown = Was das Modell an den Antastungen übrig lässt, ist auf das { FIXED($times, decimals: 1) }-Fache gewachsen.
    .remedy = Die Antastungen und die Temperaturen der letzten Tage ansehen.
