from ._certificate import certificate_of as certificate_of
from ._files import write_certificate as write_certificate, write_report as write_report
from ._header import condition_section as condition_section
from ._html import render_html as render_html
from ._pdf import document_pdf as document_pdf
from ._showable import unshowable as unshowable
