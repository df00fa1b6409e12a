from .field_csv import (
    read_field_csv as read_field_csv,
)
from .flir import is_jpeg as is_jpeg, read_flir as read_flir
