"""The compensation as text for a PLC: one tree, printed as ST, SCL and C.

What the block does is `thermaxis.compensation.cycle`, in the number type of the target. It is
built once (`_build`), as a tree of few kinds of statement (`_tree`), and every dialect prints the
same tree.
"""
