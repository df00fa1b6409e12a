### The morning board of a fleet, and the story of a machine.

common-page_fleet = Fleet
fleet-title = Night of { $day }
fleet-no_nights = No night has been done yet
fleet-named = { $count } of { $all } machines need a look
fleet-quiet = The others: { $count }
fleet-more = { $count } more: choose by kind or name.
fleet-all = All machines
fleet-look = What needs a look

fleet-need_set_aside = Set aside
fleet-do_set_aside = The night of this machine failed twice: tell whoever looks after the fleet.
fleet-since = since { $day }
fleet-need_sensors = Sensor
fleet-need_proposal = A model is proposed
fleet-do_proposal = Compare what is left before and after, then accept or reject it.

fleet-kind = Kind
fleet-every_kind = every kind
fleet-text = Name contains
fleet-choose = Choose
fleet-machine = Machine
fleet-day = Night of
fleet-outcome = Model
fleet-outcome_verified = verified
fleet-outcome_unverified = not verified
fleet-outcome_set_aside = set aside
fleet-outcome_none = no night yet
fleet-touches = Touches
fleet-rmse = Left [µm]
fleet-mean = Mean [µm]
fleet-offset_mae = With touches [µm]
fleet-found = Found

fleet-model = model
fleet-models = Models that were in force
fleet-nights = Nights
fleet-residual = What the model leaves each night
fleet-rmse_of_night = Root mean square
fleet-mean_of_night = Mean
fleet-offset_of_night = Mean magnitude with touches
fleet-no_figures = No night has verified the model yet.
fleet-mark_model = model { $sha256 }: { $why }
fleet-mark_proposed = model { $sha256 } proposed
fleet-mark_accepted = { $who } has accepted { $sha256 }: { $why }
fleet-mark_rejected = { $who } has rejected { $sha256 }: { $why }
fleet-mark_withdrawn = { $who } has withdrawn { $sha256 }: { $why }

fleet-axis = Axis { $axis }: figures of ISO 230-2 [{ $unit }]
fleet-start = Start
fleet-run = Run
fleet-drift_free = { $figure } without drift

fleet-proposals = Proposals
fleet-proposed = Model { $sha256 }, proposed by the night of { $day }
fleet-open = nobody has decided
fleet-why = Why
fleet-accept = Accept
fleet-reject = Reject
fleet-nothing_written = Nothing is written onto the machine: what is accepted is put into its folder of models, and chosen there.
fleet-download = Download
fleet-who_decides = An engineer who has logged in decides.
fleet-nobody_decides = This page was started without a file of users: nobody decides here.
fleet-decided_before = Not done: somebody has decided before, or a newer model is proposed. Load the page again.
fleet-no_why = Say why.
fleet-no_decision = This is no decision on a proposal.
fleet-no_machine = The registry has no such machine.
fleet-no_model = No accepted proposal has this hash.
fleet-no_registry = The registry cannot answer: { $said }
