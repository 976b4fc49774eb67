# The studio as a container: `docker build -t capture-studio .`, then `docker compose up` (compose.yaml) or docs/docker.md.
FROM python:3.12-slim AS build
RUN pip install --no-cache-dir uv==0.13.9
WORKDIR /app
ENV UV_LINK_MODE=copy UV_NO_CACHE=1 UV_PYTHON_DOWNLOADS=never UV_COMPILE_BYTECODE=1
COPY pyproject.toml uv.lock README.md LICENSE ./
RUN uv sync --frozen --no-dev --no-install-project
COPY studio ./studio
RUN uv sync --frozen --no-dev --no-editable

FROM python:3.12-slim
RUN useradd --create-home --uid 1000 studio \
    && mkdir /sessions \
    && chown studio:studio /sessions
COPY --from=build /app/.venv /app/.venv
ENV PATH="/app/.venv/bin:$PATH" PYTHONUNBUFFERED=1 STUDIO_HOST=0.0.0.0 STUDIO_PORT=8000 STUDIO_SESSIONS=/sessions \
    NUMBA_CACHE_DIR=/home/studio/.cache/numba
USER 1000
WORKDIR /home/studio
EXPOSE 8000
VOLUME /sessions
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s --retries=3 \
    CMD ["python", "-c", "import urllib.request as r; r.urlopen('http://127.0.0.1:8000/health', timeout=3)"]
STOPSIGNAL SIGTERM
ENTRYPOINT ["studio"]
CMD ["serve"]
