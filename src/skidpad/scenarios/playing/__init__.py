"""A compiled scenario at work: the player, the storyboard being told, controllers, what is left behind."""
