from ._files import write_report as write_report
from ._header import statements as statements
from ._html import render_html as render_html
from ._pdf import document_pdf as document_pdf
from ._showable import unshowable as unshowable
