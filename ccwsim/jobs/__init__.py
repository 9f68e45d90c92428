"""Long computations on threads: jobs, their queue, and the limits of the server."""
