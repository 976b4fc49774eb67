"""The camera client: one source, linked to the server. It keeps sent frames until the server has stored them."""
