"""The page of the model in force."""
