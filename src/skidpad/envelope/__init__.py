"""How fast is safe here and now: grip and sight from the car's own signals, and the speed inside them."""
