"""The server: camera link, REST routes and events under `/api/v1`. No mathematics here.

`app` puts the routes together: `link` (WebSocket of the camera clients), `stage` (status, recording, settings,
calibration), `takes` (lists, solves, exports), `events` (WebSocket with the status). `errors` words failures,
`origin` keeps other sites' pages out, `jobs` runs long work in processes, `server` runs it all, `demo` starts
the simulated cameras. Requests and answers are described in docs/api.md, the link in docs/protocol.md.
"""
