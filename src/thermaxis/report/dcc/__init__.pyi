from ._certificate import dcc_xml as dcc_xml
