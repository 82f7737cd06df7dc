"""The security headers of pages. A page loads only files of its own origin and one inline script, the import map."""

from __future__ import annotations

import base64
import hashlib


def page_headers(inline_script: str) -> dict[str, str]:
    """Return the headers of a page with an inline script, which may be empty."""
    return {
        "Content-Security-Policy": content_security_policy(inline_script),
        "Cross-Origin-Opener-Policy": "same-origin",
        "Referrer-Policy": "same-origin",
        "X-Content-Type-Options": "nosniff",
        "Cache-Control": "no-store",
    }


def content_security_policy(inline_script: str) -> str:
    """Return the Content-Security-Policy of a page.

    Examples
    --------
    >>> content_security_policy("").split("; ")[:2]
    ["default-src 'none'", "script-src 'self'"]
    """
    inline = f" '{_source_hash(inline_script)}'" if inline_script else ""
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src 'self'{inline}",
            "style-src 'self'",
            "img-src 'self'",
            "media-src 'self'",
            "connect-src 'self'",
            "form-action 'self'",
            "base-uri 'none'",
            "frame-ancestors 'none'",
        )
    )


def _source_hash(script: str) -> str:
    digest = hashlib.sha256(script.encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode()}"
