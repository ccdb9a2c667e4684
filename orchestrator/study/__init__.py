"""Questions: scenes, and the study files that span them."""
