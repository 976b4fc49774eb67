"""The simulated performer: motion, acting, and the figure posed at an instant."""
