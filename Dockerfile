FROM python:3.12-slim

RUN useradd --create-home --uid 1000 studio \
    && mkdir /app /sessions \
    && chown studio:studio /app /sessions \
    && pip install --no-cache-dir uv==0.13.9
USER 1000
WORKDIR /app
ENV UV_LINK_MODE=copy UV_NO_CACHE=1 UV_PYTHON_DOWNLOADS=never PATH="/app/.venv/bin:$PATH"

COPY --chown=studio:studio pyproject.toml uv.lock README.md ./
RUN uv sync --frozen --no-dev --no-install-project
COPY --chown=studio:studio studio ./studio
RUN uv sync --frozen --no-dev

EXPOSE 8000
VOLUME /sessions
HEALTHCHECK --interval=30s --start-period=20s \
    CMD ["python", "-c", "import urllib.request as r; r.urlopen('http://127.0.0.1:8000/health', timeout=3)"]
CMD ["studio", "serve", "--host", "0.0.0.0", "--sessions", "/sessions"]
