"""How the camera driver's network came about: scenes, labels of a privileged expert, training."""
