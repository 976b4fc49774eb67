"""The best live solve (`ik=kalman_filter`): an extended Kalman filter over the humanoid's degrees of freedom.

The solve includes fusion: every camera's joints are rows of their own. `readings` turns cameras' frames into rows,
corrects exchanged left and right, and rejects outliers. `belief` is the state (configuration, velocity and their
covariance) and its motion prior. `correction` is one update of the state by rows, within human limits. `feet` holds
standing feet in the output pose. `body_filter` runs them, frame by frame.

Sources: iterated extended Kalman filter as Gauss-Newton on the posterior (Bell, Cathey, "The iterated Kalman
filter update as a Gauss-Newton method", IEEE TAC 1993); validation gate and white-noise acceleration (Bar-Shalom,
Li, Kirubarajan, "Estimation with applications to tracking and navigation", 2001, sections 5.2 and 6.2).
"""
