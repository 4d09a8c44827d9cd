"""What is in an episode: actors by id, their blueprints, shapes and contacts; walkers; lights and signs."""
