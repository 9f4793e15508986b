"""Affine maps of space, as scenes have them."""
import numpy as np


class _Chained:
    """A method that continues a transform, t.scale(2), or begins one, ScalarTransform4f.scale(2)."""

    def __init__(self, make):
        self.make, self.__doc__ = make, make.__doc__

    def __get__(self, instance, owner):
        def method(*args, **kwargs):
            made = owner(self.make(*args, **kwargs))
            return made if instance is None else instance @ made

        method.__doc__ = self.__doc__
        return method


def _vector(x, y, z):
    """Three numbers, or one sequence of three, or one number for all."""
    if y is None and z is None:
        x, y, z = np.broadcast_to(np.asarray(x, dtype=float), 3)
    if y is None or z is None:
        raise TypeError("a vector has one or three numbers")
    return np.array([x, y, z], dtype=float)


def _translate(x, y=None, z=None):
    """Moves by a vector (3,)."""
    matrix = np.eye(4)
    matrix[:3, 3] = _vector(x, y, z)
    return matrix


def _scale(x, y=None, z=None):
    """Scales by a vector (3,), or by a number in all directions."""
    return np.diag([*_vector(x, y, z), 1.0])


def _rotate(axis, angle):
    """Turns by `angle` degrees around an axis (3,) of any length, counterclockwise seen from its tip."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] = cos * np.eye(3) + sin * cross + (1 - cos) * np.outer([x, y, z], [x, y, z])
    return matrix


def _look_at(origin, target, up):
    """Of a sensor at `origin` that looks at `target`, with `up` (3,) upwards in its picture."""
    origin, target, up = (np.asarray(v, dtype=float) for v in (origin, target, up))
    forward = (target - origin) / np.linalg.norm(target - origin)
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3] = np.stack([left, np.cross(forward, left), forward, origin], axis=1)
    return matrix


class ScalarTransform4f:
    """A 4 x 4 matrix that maps points; the identity without arguments. `a @ b` maps by b first; t.scale(2) is
    t @ ScalarTransform4f.scale(2)."""

    def __init__(self, matrix=None):
        self.matrix = np.eye(4) if matrix is None else np.array(getattr(matrix, "matrix", matrix), dtype=float)
        if self.matrix.shape != (4, 4):
            raise ValueError(f"a transform is a matrix of 4 x 4 numbers, not of shape {self.matrix.shape}")

    translate = _Chained(_translate)
    scale = _Chained(_scale)
    rotate = _Chained(_rotate)
    look_at = _Chained(_look_at)

    def inverse(self):
        """The transform back: (t.inverse() @ t) changes nothing. numpy.linalg.LinAlgError: there is none."""
        return ScalarTransform4f(np.linalg.inv(self.matrix))

    def __matmul__(self, other):
        """With another transform: both, one after the other. With points (3,) or (n, 3): where they come to lie."""
        if isinstance(other, ScalarTransform4f):
            return ScalarTransform4f(self.matrix @ other.matrix)
        return np.asarray(other, dtype=float) @ self.matrix[:3, :3].T + self.matrix[:3, 3]

    def __eq__(self, other):
        return isinstance(other, ScalarTransform4f) and np.array_equal(self.matrix, other.matrix)

    def __repr__(self):
        return f"ScalarTransform4f({self.matrix.tolist()})"
