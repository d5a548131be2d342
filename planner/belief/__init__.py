"""What is known of the target: priors, the transition model, particles."""
