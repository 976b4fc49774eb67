"""Several simulated performers on one stage: how they meet, and what cameras see of them."""
