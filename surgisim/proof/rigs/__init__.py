"""The apparatus of the real recordings whose cause is known: how their data become points, forces and questions."""
