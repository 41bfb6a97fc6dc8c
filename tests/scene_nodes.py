"""What a viser server's scene does, as far as the viewer asks for it: it keeps what is added, by name."""

from types import SimpleNamespace

import numpy as np


class Nodes:
    """A scene that is not served; a node without its parent is refused, as the browser would not place it."""

    def __init__(self):
        self.added = {}

    def _keep(self, name, **given):
        assert name not in self.added, f"{name} is made anew"
        parent = name.rsplit("/", 1)[0]
        assert parent.count("/") == 1 or parent in self.added, f"{name} has no parent"
        self.added[name] = SimpleNamespace(position=np.zeros(3), wxyz=np.array([1.0, 0.0, 0.0, 0.0]), visible=True)
        vars(self.added[name]).update(given)
        return self.added[name]

    def add_frame(self, name, **given):
        return self._keep(name, **given)

    def add_mesh_simple(self, name, vertices, faces, **given):
        return self._keep(name, vertices=vertices, faces=faces, **given)

    def add_batched_meshes_simple(self, name, vertices, faces, batched_wxyzs, batched_positions, **given):
        placed = {"batched_wxyzs": batched_wxyzs, "batched_positions": batched_positions}
        return self._keep(name, vertices=vertices, faces=faces, **placed, **given)

    def add_label(self, name, text, **given):
        return self._keep(name, text=text, **given)
