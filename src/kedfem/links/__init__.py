"""Links: scalar functions times R³, with constant mass and stiffness; the only package that uses scikit-fem."""
