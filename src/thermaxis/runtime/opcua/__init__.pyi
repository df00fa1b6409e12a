from ._browse import (
    FoundNode as FoundNode,
    browse_server as browse_server,
)
from ._certificates import (
    Certificate as Certificate,
    certificate_of as certificate_of,
    check_own_pair as check_own_pair,
    private_key_of as private_key_of,
    validity_warning as validity_warning,
)
from ._failures import (
    FAILURES as FAILURES,
    explain as explain,
)
from ._fetch import (
    ServerOffer as ServerOffer,
    fetch_offers as fetch_offers,
)
from ._link import (
    Link as Link,
    MethodAnswer as MethodAnswer,
    call_method as call_method,
    connect_once as connect_once,
    discard as discard,
    take_leave as take_leave,
)
from ._new_certificates import (
    DEFAULT_DAYS as DEFAULT_DAYS,
    CertificateUse as CertificateUse,
    NewCertificate as NewCertificate,
    make_pair as make_pair,
    write_certificate as write_certificate,
    write_pair as write_pair,
)
from ._nodes import (
    parse_node as parse_node,
)
from ._pair import (
    load_pair as load_pair,
)
from ._session import (
    NodeDescription as NodeDescription,
    OpcUaSession as OpcUaSession,
)
from ._values import (
    WRONG_TYPE as WRONG_TYPE,
    content_of as content_of,
    is_good as is_good,
    next_beat as next_beat,
    plain_number as plain_number,
    status_name as status_name,
)
