"""Give the canonical scene the depth that a simulation needs.

reads   scene.ply, camera.json
writes  body.npz        particles of tissue in frame 0, camera frame [m]
        body.ply        the same as coloured points
        body_mesh.ply   the closed surface around them
"""

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.config.thickening import Thickening
from surgisim.stage import Bytes, stage


@stage(
    reads={"scene": Scene, "camera": Camera},
    writes={"body": Body, "points": Bytes(".ply"), "mesh": Bytes(".ply")},
    settings=Thickening,
)
def main(scene, camera, *, settings, progress):
    from surgisim.gaussians.surface import surface_of
    from surgisim.thickening import mesh, points, thicken

    surface = surface_of(scene, camera, least_cover=settings.least_cover, smooth=settings.smooth)
    body = thicken(surface, camera, settings, centers=scene.mean, progress=progress)
    return body, points(body), mesh(body)


if __name__ == "__main__":
    main()
