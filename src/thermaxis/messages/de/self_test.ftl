### Befunde des Selbsttests

## Connections

self_test-not_connected = Nicht verbunden: { $why }
    .remedy = Ohne die Maschine wird nichts korrigiert; es wird auf sie gewartet.
self_test-no_more_answers = Der Server antwortet nicht mehr: { $why }
    .remedy = Server und Netz prüfen.
self_test-failed = Der Selbsttest selbst ist gescheitert: { $cause }
    .remedy = Die Ursache dem melden, der dieses Programm pflegt.
self_test-server_without_time = Der Server nennt seine Zeit nicht: Das Alter der Werte ist nicht bekannt.
    .remedy = Den Server seine Zeit nennen lassen oder time_stamp_required = false schreiben.
self_test-clock_ahead = Verbunden; die Uhr des Servers geht gegenüber diesem Rechner { FIXED($difference_s, decimals: 1) } s vor.
    .remedy = Eine der Uhren stellen; das Alter der Werte gilt nach der Uhr des Servers, Aufzeichnungen nach der dieses Rechners.
self_test-clock_behind = Verbunden; die Uhr des Servers geht gegenüber diesem Rechner { FIXED($difference_s, decimals: 1) } s nach.
    .remedy = Eine der Uhren stellen; das Alter der Werte gilt nach der Uhr des Servers, Aufzeichnungen nach der dieses Rechners.
self_test-connected = Verbunden; die Uhren weichen um { FIXED($difference_s, decimals: 1) } s voneinander ab (viele Server stellen ihre Zeitangabe einmal je Sekunde).
self_test-linuxcnc = LinuxCNC läuft, ist richtig eingerichtet, und die Achsen sind referenziert.
self_test-pins = LinuxCNC läuft, und seine Pins können gelesen werden.
self_test-pins_unread = Pins von LinuxCNC können nicht gelesen werden: { $why }
    .remedy = LinuxCNC starten, als der Benutzer dieses Programms.
self_test-linuxcnc_unusable = In LinuxCNC kann nicht geschrieben werden: { $why }
    .remedy = Es mit der HAL-Datei starten, die thermaxis hal schreibt, und die Achsen referenzieren.

## Nodes

self_test-no_node = Der Server hat keinen Knoten { $node } ({ $status }).
    .remedy = Den Knoten im Browser des Servers suchen und die Konfiguration berichtigen.
self_test-node_no_number = Der Knoten { $node } ist vom Typ { $type }; nötig ist eine Zahl.
    .remedy = Den Knoten im Browser des Servers suchen und die Konfiguration berichtigen.
self_test-node_no_flag = Der Knoten { $node } ist vom Typ { $type }; nötig ist ein Wahrheitswert oder eine ganze Zahl.
    .remedy = Den Knoten im Browser des Servers suchen und die Konfiguration berichtigen.
self_test-node_no_bit = Der Knoten { $node } ist vom Typ { $type }, der kein solches Bit hat; nötig ist eine ganze Zahl mit genügend Bits.
    .remedy = Den Knoten im Browser des Servers suchen und die Konfiguration berichtigen.
self_test-node_no_beat = Der Knoten { $node } ist vom Typ { $type }; nötig ist eine Zahl oder ein Wahrheitswert.
self_test-node_no_token = Der Knoten { $node } ist vom Typ { $type }; nötig ist eine Zahl mit 32 Bit oder mehr.
    .remedy = Den Knoten im Browser des Servers suchen und die Konfiguration berichtigen.

## Inputs

self_test-input = { FIXED($value_c, decimals: 1) } °C.
self_test-input_age = { FIXED($value_c, decimals: 1) } °C, { FIXED($age_s, decimals: 1) } s alt.
self_test-input_no_value = Es gibt keinen Wert: { $status }.
    .remedy = Den Sensor prüfen; ohne guten Wert wird nichts korrigiert.
self_test-no_time_stamp = Der Wert hat keinen brauchbaren Zeitstempel, sein Alter ist nicht bekannt.
    .remedy = Den Server einen Zeitstempel setzen lassen oder time_stamp_required = false schreiben; ein eingefrorener Wert wird dann nur durch frozen_s erkannt.
self_test-value_old = Der Wert ist { FIXED($age_s, decimals: 0) } s alt, erlaubt sind { $longest_age_s } s.
    .remedy = Den Sensor prüfen; manche Server stempeln einen Wert nur bei Änderung: dann longest_age_s anheben.
self_test-input_other_unit = Der Wert { $raw } ist nach der Konfiguration { $value_c } °C und damit unplausibel ({ $lowest_c } bis { $highest_c } °C); plausibel wäre er mit { $others }.
    .remedy = Die Einheit des Knotens prüfen und gegebenenfalls { $first } schreiben.
self_test-input_zero = { FIXED($value_c, decimals: 1) } °C ist unplausibel ({ $lowest_c } bis { $highest_c } °C); ein offener Eingang liefert oft 0.
    .remedy = Sensor, Einheit und plausiblen Bereich prüfen.
self_test-input_implausible = { FIXED($value_c, decimals: 1) } °C ist unplausibel ({ $lowest_c } bis { $highest_c } °C).
    .remedy = Sensor, Einheit und plausiblen Bereich prüfen.
self_test-redundant_differs = Der redundante Sensor weicht um { SIGNED($difference_k, decimals: 1) } K ab, erlaubt sind { $largest_k } K.
    .remedy = Beide Sensoren prüfen: Einer ist falsch, oder sie sitzen nicht am selben Ort.

## Flags and diameter

self_test-flag_no_truth = Der Wert ist { $value }, ein Merker ist 0 oder 1.
    .remedy = Einen Knoten angeben, der wahr oder falsch, 0 oder 1 ist; jede andere Zahl gilt als kein Wert.
self_test-interlock_met = Sie ist erfüllt.
self_test-interlock_open = Sie ist zurzeit nicht erfüllt.
    .remedy = Bis sie erfüllt ist, wird nichts korrigiert.
self_test-interlock_no_value = Es gibt keinen Wert: { $status }.
    .remedy = Ohne Wert gilt die Verriegelung als verlorener Eingang: Nichts wird eingeschaltet, und eine wirkende Korrektur wird eine Weile gehalten und dann abgebaut.
self_test-other_compensation_no_value = Es gibt keinen Wert: { $status }.
    .remedy = Auf anderem Weg sicherstellen, dass die Kompensation des Herstellers aus ist.
self_test-other_compensation_active = An der Maschine ist eine andere Kompensation aktiv: Beide zusammen sind falsch.
    .remedy = Die Kompensation des Herstellers ausschalten oder thermaxis ausgeschaltet lassen.
self_test-other_compensation_off = Keine andere Kompensation ist aktiv.
self_test-diameter = { $diameter_mm } mm.
self_test-diameter_no_value = Es gibt keinen Wert: { $status }.
    .remedy = Ein Bediener kann ihn angeben.
self_test-diameter_implausible = { $diameter_mm } mm ist für ein Werkstück unplausibel.
    .remedy = Knoten und Einheit prüfen.
self_test-diameter_outside = { $diameter_mm } mm liegt außerhalb der Verstärkungen des Modells, { $least_mm } bis { $most_mm } mm: Es gilt die am Ende.
    .remedy = Knoten und Einheit prüfen.

## Probes

self_test-probe = { SIGNED($value_um, decimals: 1) } µm, Alter unbekannt.
self_test-probe_age = { SIGNED($value_um, decimals: 1) } µm, { FIXED($age_s, decimals: 1) } s alt.
self_test-probe_counter = Der Zähler steht auf { $count }.
self_test-probe_no_value = Es gibt keinen Wert: { $status }.
    .remedy = Die Kompensation braucht den Messtaster nicht.
self_test-probe_unusable = Der Messtaster ist nicht nutzbar: { $why }
    .remedy = Die Kompensation kommt ohne ihn aus; die Konfiguration berichtigen.
self_test-probe_not_asked = Der Messtaster kann nicht gefragt werden, seine eigene Verbindung zum Server der Eingänge antwortet nicht: { $why }
    .remedy = Die Kompensation kommt ohne ihn aus; es wird von selbst erneut versucht.

## Outputs

self_test-output = In der Maschine steht ein Offset von { FIXED($found_um, decimals: 1) } µm.
self_test-output_not_writable = Der Server lässt diesen Benutzer den Offset nicht schreiben.
    .remedy = Dem Benutzer das Schreibrecht geben; an einer SINUMERIK mit der Methode GiveUserAccess.
self_test-output_unreadable = Der Offset in der Maschine kann nicht gelesen werden: { $status }.
    .remedy = Ihn lesbar machen: Eine Korrektur beginnt dort, wo der Offset steht.
self_test-output_always_zero = Der Knoten nimmt nur ganze { $unit }: Eine Korrektur bis { $total_um } µm wird immer als 0 geschrieben.
    .remedy = Die Einheit prüfen oder die SPS eine feinere anbieten lassen.
self_test-output_too_narrow = Eine Korrektur von { $total_um } µm passt in { $unit } nicht in { $type }.
    .remedy = Die Einheit prüfen oder die Grenzen senken.
self_test-output_coarse = Der Knoten nimmt nur ganze { $unit }: Die Korrektur bewegt sich in Schritten von { $step_um } µm, was die Oberfläche zeichnen kann.
    .remedy = Die SPS eine feinere Einheit anbieten lassen; zählt sie schon feiner, etwa in 0.1 um?
self_test-output_other_unit = Der vorgefundene Offset ist { $raw }, in { $unit } { $found_um } µm: weit über der Grenze von { $total_um } µm, aber plausibel in { $others }.
    .remedy = Die Einheit prüfen; stimmt sie, den Offset von Hand auf null setzen.
self_test-output_beyond = In der Maschine steht ein Offset von { FIXED($found_um, decimals: 1) } µm, über der Grenze von { $total_um } µm.
    .remedy = Herausfinden, wer ihn geschrieben hat; nach dem Einschalten ist er ein Fehler und geht mit der erlaubten Geschwindigkeit auf null.
self_test-read_back = Die Maschine meldet { FIXED($reported_um, decimals: 1) } µm.
self_test-read_back_no_value = Es gibt keinen Wert: { $status }.
    .remedy = Wird zu lange nichts zurückgelesen, ist das ein Fehler.
self_test-read_back_differs = Die Maschine meldet { FIXED($reported_um, decimals: 1) } µm, { SIGNED($difference_um, decimals: 1) } µm neben dem zuletzt geschriebenen Wert.
    .remedy = Ohne Lebenszeichen kann die Maschine den Offset zurückgenommen haben; sonst den Knoten prüfen.
self_test-heartbeat = Es kann geschrieben werden.
self_test-life = Der Lebenszähler ist da.
self_test-heartbeat_not_writable = Der Server lässt diesen Benutzer das Lebenszeichen nicht schreiben.
    .remedy = Dem Benutzer das Schreibrecht geben.
self_test-offset_gone = Der Offset hat keinen Wert mehr: { $status }.
    .remedy = Erneut versuchen.
self_test-offset_not_written_back = Der vorgefundene Offset kann nicht zurückgeschrieben werden: { $status }.
    .remedy = Dem Benutzer das Schreibrecht geben und prüfen, ob die Maschine in der jetzigen Betriebsart schreiben lässt.
self_test-offset_written_back = Der vorgefundene Offset wurde zurückgeschrieben: Er ist schreibbar.
self_test-history_unreachable = Die Datenbank des Verlaufs ist jetzt nicht erreichbar: { $cause }. Aufzeichnungen warten so lange im Speicher.
self_test-port_unusable = An Port { $port } kann jetzt niemand lauschen: { $cause }. Läuft der Bildschirm dieser Maschine, so belegt er ihn selbst; läuft er nicht, so wird er nicht starten.
