from ._lake import Lake as Lake
from ._shipping import Shipment as Shipment, ship as ship
