"""The security headers of pages. A page loads only files of its own origin and one inline script, the import map.

Where the operator allows it, the dashboard also connects to the bridge of a panel on the machine of its user.
"""

from __future__ import annotations

import base64
import hashlib
from urllib.parse import urlsplit


def page_headers(inline_script: str, *, panel_url: str = "") -> dict[str, str]:
    """Return the headers of a page with an inline script, which may be empty.

    Parameters
    ----------
    inline_script
        The text of the script.
    panel_url
        The address of the bridge of a Looking Glass panel, to which the page may connect; empty for none.
    """
    return {
        "Content-Security-Policy": content_security_policy(inline_script, panel_url=panel_url),
        "Cross-Origin-Opener-Policy": "same-origin",
        "Referrer-Policy": "same-origin",
        "X-Content-Type-Options": "nosniff",
        "Cache-Control": "no-store",
    }


def content_security_policy(inline_script: str, *, panel_url: str = "") -> str:
    """Return the Content-Security-Policy of a page.

    Examples
    --------
    >>> content_security_policy("").split("; ")[:2]
    ["default-src 'none'", "script-src 'self'"]
    >>> content_security_policy("", panel_url="ws://localhost:11222/driver").split("; ")[5]
    "connect-src 'self' ws://localhost:11222"
    """
    inline = f" '{_source_hash(inline_script)}'" if inline_script else ""
    panel = f" ws://{urlsplit(panel_url).netloc}" if panel_url else ""
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src 'self'{inline}",
            "style-src 'self'",
            "img-src 'self'",
            "media-src 'self'",
            f"connect-src 'self'{panel}",
            "form-action 'self'",
            "base-uri 'none'",
            "frame-ancestors 'none'",
        )
    )


def _source_hash(script: str) -> str:
    digest = hashlib.sha256(script.encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode()}"
