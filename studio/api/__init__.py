"""The server's API: camera link, REST routes and events under `/api/v1`. No mathematics here.

`app` joins the routes. `cameras` has the WebSocket of the camera clients, `stage` the live stage (status, recording,
settings, calibration, events), `takes` lists, solves and exports, `sharing` blind tests and replays, `access` signing
in. `errors` turns failures into answers, `origin` refuses other sites' pages, `jobs` runs long work in processes.
docs/api.md describes requests and answers, docs/protocol.md the link.
"""
