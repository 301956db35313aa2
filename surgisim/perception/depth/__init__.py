"""How far away the tissue is, in every frame. One file per backend; distance.py chooses."""
