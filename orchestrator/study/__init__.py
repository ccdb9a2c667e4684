"""What is asked: scenes, and the study files that span them."""
