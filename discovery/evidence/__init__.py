"""What recordings say of a claim: noise, whitening, signatures, Bayes factors, a latent force, events."""
