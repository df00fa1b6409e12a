"""Configuration files of a machine with two inputs and one output, as the tests change them."""

from pathlib import Path

from thermaxis.compensation import CompensationModel, Output, Part, Section
from thermaxis.files import write_model

TEXT = """\
[machine]
name = "vertical lathe"
model = "models/lathe.json"
model_folder = "models"
cycle_s = 1.0

[connection.control]
url = "opc.tcp://127.0.0.1:4840/lathe"
security = "none"

[source]
kind = "opcua"
connection = "control"

[sink]
kind = "opcua"
connection = "control"
heartbeat_node = "ns=2;s=Heartbeat"

[input.T_spindle_C]
node = "ns=2;s=T_spindle"
unit = "degC"
lowest_c = 5.0
highest_c = 90.0
redundant_node = "ns=2;s=T_spindle_2"

[input.T_column_C]
node = "ns=2;s=T_column"
unit = "K"
lowest_c = 5.0
highest_c = 60.0
largest_rate_k_per_s = 0.05

[interlock.referenced]
node = "ns=2;s=Z_referenced"
met = true

[interlock.emergency_stop]
node = "ns=2;s=EmergencyStop"
met = false

[other_compensation]
node = "ns=2;s=OwnCompensation"
active = true

[diameter]
node = "ns=2;s=Diameter"
unit = "mm"

[output.Z_um]
largest_um = 100.0
largest_rate_um_per_s = 0.5
node = "ns=2;s=Z_offset"
read_back_node = "ns=2;s=Z_accepted"
unit = "mm"
sign = "positive moves the tool away from the workpiece"

[supervisor]
hold_input_s = 120.0

[validity]
margin_k = 4.0

[historian]
url = "sqlite:///history/lathe.db"
retention_days = 30
"""


def model(*channels: str, output: str = "Z_um", gain: float = 10.0) -> CompensationModel:
    """Return a model with one part: the first channel minus the second."""
    plus, minus = channels or ("T_spindle_C", "T_column_C")
    part = Part(
        "spindle", plus, minus, sections=(Section(gain, 600.0),), lowest_k=-1.0, highest_k=20.0
    )
    return CompensationModel(outputs=(Output(output, (part,)),))


def machine_file(folder: Path, *changes: tuple[str, str]) -> Path:
    """Write the configuration with pieces of text replaced, and its model, into a folder."""
    models = folder / "models"
    models.mkdir(exist_ok=True)
    write_model(model(), models / "lathe.json")
    text = TEXT
    for old, new in changes:
        assert old in text, f"{old} does not stand in the file"
        text = text.replace(old, new)
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return path
