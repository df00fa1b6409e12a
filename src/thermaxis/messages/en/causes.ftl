### Why a machine of a fleet is named, and what to do

cause-sensor_frozen = sensor stands still
cause-sensors_swapped = sensors exchanged
cause-sensor_offset = sensor is off
cause-gain = answers more or less to heat
cause-time_constant = answers faster or slower to heat
cause-drift = moves without heat
cause-unknown = model fits worse

fault-sensor_frozen = { NAME($name) } gives one value while other sensors move.
    .remedy = Look at the sensor, its cable and its module.
fault-sensors_swapped = { NAME($name) } seem exchanged: the other way round they explain what the touches show.
    .remedy = Check the wiring and the sensor map.
fault-sensor_offset = At rest { NAME($name) } lies { SIGNED($departure_k, decimals: 1) } K further from its neighbours than before.
    .remedy = Compare the sensor with another one, and look whether it still sits on the machine.
fault-gain = The displacement by { NAME($name) } is { SIGNED($departure_percent, decimals: 0) } % against the model.
    .remedy = Look at what has changed: cooling, clamping, bearings. If the machine is sound, accept a model that is proposed.
fault-time_constant = The time constant of { NAME($name) } is { SIGNED($departure_percent, decimals: 0) } % against the model.
    .remedy = Look at what has changed: cooling, fans, covers. If the machine is sound, accept a model that is proposed.
fault-drift = The tool point has moved by { SIGNED($departure_um, decimals: 1) } µm without heat.
    .remedy = Was a datum set anew? Else look for wear, a collision, a loose probe; measure the axis.
fault-unknown = What the touches leave of the model has grown to { FIXED($times, decimals: 1) } times.
    .remedy = Look at the touches and the temperatures of the last days.
