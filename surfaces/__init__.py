"""What is to be covered: surfaces, their pose and working side, their E-cells, and the curves
between them.
"""
