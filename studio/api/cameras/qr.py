"""Addresses as QR codes."""

import io

import segno
from fastapi.responses import Response


def qr_picture(text: str) -> Response:
    """Return a QR code of a text as an SVG picture, dark on white."""
    out = io.BytesIO()
    segno.make(text, micro=False).save(out, kind="svg", scale=12, border=3, dark="#14171b", light="#ffffff")
    return Response(out.getvalue(), media_type="image/svg+xml", headers={"Cache-Control": "no-store"})
