from ._certificate import signature as signature
from ._files import write_certificate as write_certificate, write_report as write_report
from ._header import (
    condition_section as condition_section,
    identification as identification,
    issuer as issuer,
    prevailing as prevailing,
    statements as statements,
)
from ._html import render_html as render_html
from ._pdf import document_pdf as document_pdf
from ._showable import unshowable as unshowable
