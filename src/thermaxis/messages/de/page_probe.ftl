probe-unknown = An dieser Maschine gibt es keinen solchen Messtaster.
probe-which = Messtaster
probe-none = An dieser Maschine ist kein Messtaster eingerichtet.
probe-how = Wenn die Steuerung zeigt, was ein Messtaster misst, seinen Knoten in { $file } eintragen und die Kompensation neu starten. Der Name ist der des Ausgangs. Ein Messtaster wird nur angezeigt und aufgezeichnet, es sei denn, seine Tabelle lässt Antastungen zählen.
probe-now = Jetzt
probe-compensated = Mit Kompensation (gemessen)
probe-uncompensated = Ohne Kompensation (ohne den Versatz)
probe-model = Modell
probe-chart = Verlagerung des Werkzeugpunkts, positiv vom Werkstück weg
probe-range_compensated = Spitze-Spitze, mit Kompensation
probe-range_uncompensated = Spitze-Spitze, ohne Kompensation
probe-range_model = Spitze-Spitze, Modell
probe-ratio = Vom Fehler bleiben
probe-told_values = Aus { $count } Werten zwischen { $first } und { $last } ({ $length }). Es zählen nur Zeiten, zu denen der Messtaster gemessen hat und der Versatz bekannt ist; das Rauschen des Messtasters steckt in jeder Zahl.
probe-told_means = Aus { $count } Mittelwerten über { $step } zwischen { $first } und { $last } ({ $length }); Spitze-Spitze einzelner Werte ist etwas größer. Es zählen nur Schritte, in denen der Messtaster gemessen hat und der Versatz bekannt ist.
probe-told_nothing = In diesem Zeitraum gibt es keine Zeit, zu der der Messtaster gemessen hat und der Versatz bekannt ist.
probe-sign = Ohne Kompensation = Messtaster − wirksamer Versatz (der angenommene, wo die Steuerung den wirksamen nicht nennt). Lücken: der Messtaster misst nichts, oder die Kompensation ist aus und der Versatz wird nicht gelesen.
