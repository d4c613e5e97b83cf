"""From blows to modes: spectra and their scatter, checks of a blow, poles, shapes and their covariance."""
