"""The same in three dimensions: workspaces of boxes, path following, and the joint track in space."""
