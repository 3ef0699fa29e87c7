"""Stiffness: how far the tool gives way to a force where drives and struts are elastic."""
