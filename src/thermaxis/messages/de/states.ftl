state-Off = Aus
state-Warming = Läuft an
state-Active = Kompensiert
state-Holding = Halten
state-Fading = Läuft aus
state-Fault = Störung

reason-disabled = sie ist nicht eingeschaltet
reason-settling = das Modell läuft noch nicht lange genug
reason-recovering = alles ist wieder da; es muss einen Moment so bleiben
reason-input_bad = ein Eingang hat keinen brauchbaren Wert
reason-connection_lost = die Verbindung zur Maschine ist unterbrochen
reason-interlock_open = eine Verriegelung ist nicht erfüllt
reason-operator_hold = ein Bediener hält sie
reason-hold_expired = sie wurde so lange gehalten wie erlaubt
reason-read_back_differs = die Maschine meldet den geschriebenen Versatz nicht zurück
reason-long_at_limit = die Korrektur stand zu lange an ihrer Grenze
reason-double_compensation = eine andere Kompensation ist aktiv, oder etwas anderes schreibt den Versatz
reason-offset_outside = der in der Maschine vorgefundene Versatz liegt außerhalb der Grenzen

model_quality-good = gut
model_quality-held = gehalten
model_quality-bad = nicht brauchbar

outcome-started = das Modell wurde gestartet
outcome-waiting = das Modell wartet, bis jeder Eingang einen guten Wert hat
outcome-clock_backward = die Uhr ging rückwärts: das Modell begann neu im eingeschwungenen Zustand
outcome-clock_unusable = die Zeit der Ablesung ist keine Zahl: nichts wurde weitergerechnet
outcome-clock_still = die Uhr steht still: nichts wurde weitergerechnet
outcome-state_unusable = der gespeicherte Zustand gehört nicht zu diesem Modell: das Modell beginnt neu
outcome-gap = zu lange keine Ablesung: das Modell begann neu im eingeschwungenen Zustand
outcome-input_held = ein Eingang fiel aus: sein letzter guter Wert wird gehalten
outcome-input_failed = ein Eingang fiel länger aus, als er gehalten werden darf
outcome-diameter_held = der Durchmesser des Werkstücks liegt außerhalb des Bereichs der Verstärkungen: der Endwert gilt
outcome-diameter_unknown = kein Durchmesser des Werkstücks ist angegeben: die Verstärkung am Werkzeugmittelpunkt gilt
outcome-outside_validity = ein Eingang liegt außerhalb des Bereichs, aus dem das Modell stammt
