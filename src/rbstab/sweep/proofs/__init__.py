"""What is proved of the convergence of members: from their starts, and by their exact motions."""
