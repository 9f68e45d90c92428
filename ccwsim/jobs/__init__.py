"""Long work on threads: jobs, their queue, sessions and limits."""
