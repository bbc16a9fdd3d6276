"""Links: scalar functions times R³, with constant mass and stiffness; the only room that speaks to scikit-fem."""
