"""The page that evaluates a positioning run."""
