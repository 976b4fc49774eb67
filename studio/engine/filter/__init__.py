"""The best live solve (`ik=kalman_filter`): an extended Kalman filter over the humanoid's degrees of freedom.

Fusion happens inside the solve: every camera's joints are rows of their own. `readings` turns cameras' frames into
rows, puts left and right right, and leaves out what cannot be; `belief` is the state (configuration, velocity and
their covariance) and its motion prior; `correction` is one
correction of it by rows, within human limits; `feet` holds standing feet in the pose that is put out; `body_filter`
does it all, frame by frame.

Sources: iterated extended Kalman filter as Gauss-Newton on the posterior (Bell, Cathey, "The iterated Kalman filter
update as a Gauss-Newton method", IEEE TAC 1993); validation gate and white-noise acceleration (Bar-Shalom, Li,
Kirubarajan, "Estimation with applications to tracking and navigation", 2001, sections 5.2 and 6.2).
"""
