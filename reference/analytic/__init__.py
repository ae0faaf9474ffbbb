"""`Analytic`: the oracle in float64 NumPy, a method per step of the light path, from which every stage follows.

A renderer's mistake is a subclass in which one step is wrong. The same steps compute whole images, single image points
of nearby problems, and a stage continued from a renderer's own earlier stages.
"""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from rayproof.cases.scene import Camera, PointLight, Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic.camera import camera_answer, pixel_centers, view_of
from rayproof.reference.analytic.surfaces import Between, Crossing, surface_of
from rayproof.reference.analytic.vectors import dot, ends_of, length

Rows = Mapping[Stage, np.ndarray]  # stage -> (N, channels)
NOWHERE = -1.0  # shape and face on a miss


class Hits(NamedTuple):
    """First hits of rays (N,): (shape, face) (N, 2), -1 on a miss; t, inf on a miss; the surface's smooth piece."""

    objects: np.ndarray
    distances: np.ndarray
    pieces: np.ndarray


class RaysFromEye(NamedTuple):
    """Rays from the eye (3,) along directions (N, 3) of any length, that count between low and high (N,)."""

    eye: np.ndarray
    directions: np.ndarray
    low: np.ndarray
    high: np.ndarray


class RaysToLight(NamedTuple):
    """Shadow rays to a light from starts (N, 3) [m] on objects (N, 2), between shares of the way from the light."""

    light: PointLight
    objects: np.ndarray
    starts: np.ndarray
    between: Between = (0.0, 1.0)

    @property
    def source(self) -> np.ndarray:
        """Return the light's place (3,) [m]."""
        return np.asarray(self.light.position, dtype=np.float64)

    @property
    def segments(self) -> np.ndarray:
        """Return the ways (N, 3) [m] from the light to the starts."""
        return self.starts - self.source


@dataclass(frozen=True, kw_only=True)
class Freedom:
    """The changes of a nearby problem at each image point (N,), in addition to the scene's numbers; 0 is none."""

    lift: np.ndarray | float = 0.0  # m: how far above the hit, along the normal, shadow rays start
    tie: np.ndarray | float = 0.0  # m: one of the surfaces no farther than this behind the first is hit, at random,
    named: np.ndarray | None = None  # or the (shape, face) named here (N, 2) if it is one of them
    near: float = 0.0  # m: hits nearer to the eye do not count
    blind: np.ndarray | float = 0.0  # m: blockers nearer to the start of a shadow ray do not count
    light: float = 0.0  # of a shadow ray's length: blockers nearer to the light do not count
    slide: np.ndarray | float = 0.0  # m: distance along the ray from the hit to the place of the normal
    plane: np.ndarray | bool = (
        False  # a light below the plane of the hit face is not visible, whatever the shading normal
    )
    draw: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))


@dataclass(frozen=True, kw_only=True)
class Samples:
    """The oracle's answers at image points (N,), with the contribution of each light if it were visible."""

    rows: dict[Stage, np.ndarray]  # every requested image stage, (N, channels)
    pieces: np.ndarray  # (N,): the smooth piece of the surface that is hit
    shares: np.ndarray | None = None  # (N, lights, 3): irradiance of each light, whether visible or not
    factors: dict[Stage, np.ndarray] = field(default_factory=dict)  # (N, 3): the factor of irradiance
    ambient: dict[Stage, np.ndarray] = field(
        default_factory=dict
    )  # (N, 3): the value of a stage of light without lights


class Analytic:
    """Closed-form geometry in float64; shares neither code, algebra nor compiler with the tracer.

    Its rounding error is a few units of 2^-53 relative to the scene's coordinates, times the condition of the shapes'
    matrices and of grazing incidence: nine digits below float32 wherever a float32 tracer can be judged.
    """

    precision = "float64"
    takes_sample_offset = True

    def version(self) -> str:
        """Return program and version, for the report."""
        return f"analytic 1 (numpy {np.__version__})"

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return None: every valid scene and stage is answered."""
        return None

    # The steps, in their order. A mistake overrides one.

    def scene(self, scene: Scene) -> Scene:
        """Return the scene that is rendered."""
        return scene

    def camera_matrices(self, camera: Camera) -> dict[str, np.ndarray]:
        """Return the answer to the camera stage, as `cases.stages` describes it."""
        return camera_answer(camera)

    def image_points(self, scene: Scene, points: np.ndarray) -> np.ndarray:
        """Return the image points (N, 2) [px] through which the rays for the given image points pass."""
        return points

    def rays(self, scene: Scene, points: np.ndarray) -> np.ndarray:
        """Return unit directions (N, 3) through image points (N, 2) [px]."""
        directions = view_of(scene.camera).directions(points)
        return directions / length(directions)[:, np.newaxis]

    def clip_interval(self, scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the open interval (low, high) of t for hits, along directions (N, 3) of any length."""
        camera = scene.camera
        near, far = np.full(len(directions), camera.near), np.full(len(directions), camera.far)
        if scene.clip == "shell":
            return near, far
        if scene.clip == "none":
            return np.zeros(len(directions)), np.full(len(directions), np.inf)
        with np.errstate(all="ignore"):
            depth_speed = directions @ view_of(camera).forward
            return near / depth_speed, far / depth_speed

    def nearest(self, scene: Scene, directions: np.ndarray, freedom: Freedom | None = None) -> Hits:
        """Return the first hits of rays from the eye inside the clip interval. Equal t: the lower index."""
        eye = np.asarray(scene.camera.eye, dtype=np.float64)
        low, high = self.clip_interval(scene, directions)
        if freedom is not None and freedom.near:
            low = np.maximum(low, freedom.near)
        hits = Hits(
            np.full((len(directions), 2), NOWHERE), np.full(len(directions), np.inf), np.zeros(len(directions), int)
        )
        for index in range(len(scene.shapes)):
            crossing = self.crossing(scene, index, RaysFromEye(eye, directions, low, high))
            _put(hits, crossing.distance < hits.distances, index, crossing)
        if freedom is not None and np.any(freedom.tie):
            self._choose_among_coinciding(scene, eye, directions, low, high, hits, freedom)
        return hits

    def crossing(self, scene: Scene, index: int, rays: RaysFromEye) -> Crossing:
        """Return the first intersections of rays with a shape."""
        return surface_of(scene.shapes[index]).first(*rays)

    def _choose_among_coinciding(
        self,
        scene: Scene,
        eye: np.ndarray,
        directions: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        hits: Hits,
        freedom: Freedom,
    ) -> None:
        """Replace each hit by one on a random surface that coincides with the first within `freedom.tie`."""
        last = np.minimum(hits.distances + freedom.tie, np.nextafter(high, -np.inf))
        rays_that_hit = np.flatnonzero(np.isfinite(hits.distances))
        least = np.full(len(rays_that_hit), np.inf)
        for index, shape in enumerate(scene.shapes):
            surface = surface_of(shape)
            crossing, drawn = surface.any_of(
                eye, directions[rays_that_hit], low[rays_that_hit], last[rays_that_hit], freedom.draw
            )
            chosen = drawn < least
            least[chosen] = drawn[chosen]
            where = np.zeros(len(directions), dtype=bool)
            where[rays_that_hit[chosen]] = True
            whole = Crossing(*(np.zeros(len(directions), dtype=part.dtype) for part in crossing))
            for part, values in zip(whole, crossing, strict=True):
                part[rays_that_hit] = values
            _put(hits, where, index, whole)
        if freedom.named is not None:
            distances = self.distances(scene, directions, freedom.named, freedom)
            there = np.flatnonzero(distances <= last)
            hits.objects[there], hits.distances[there] = freedom.named[there], distances[there]
            rows = {Stage.RAY: directions[there], Stage.OBJECT: hits.objects[there]}
            at = self.positions(scene, rows[Stage.RAY], rows[Stage.OBJECT], distances[there, np.newaxis])
            hits.pieces[there] = self.pieces_at(scene, rows | {Stage.POSITION: at})

    def distances(
        self, scene: Scene, directions: np.ndarray, objects: np.ndarray, freedom: Freedom | None = None
    ) -> np.ndarray:
        """Return t (N,) of the first crossing, inside the clip interval, with the given (shape, face); inf without."""
        eye = np.asarray(scene.camera.eye, dtype=np.float64)
        low, high = self.clip_interval(scene, directions)
        if freedom is not None and freedom.near:
            low = np.maximum(low, freedom.near)
        distances = np.full(len(directions), np.inf)
        for index, shape in enumerate(scene.shapes):
            rays_of_shape = np.flatnonzero(objects[:, 0] == index)
            if len(rays_of_shape):
                surface, arguments = (
                    surface_of(shape),
                    (eye, directions[rays_of_shape], low[rays_of_shape], high[rays_of_shape]),
                )
                distances[rays_of_shape] = surface.first(*arguments, only=objects[rays_of_shape, 1]).distance
        return distances

    def positions(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Return hit points eye + t d (N, 3) [m], 0 on a miss."""
        hit = (objects[:, :1] >= 0) & np.isfinite(distances)
        with np.errstate(all="ignore"):
            return np.where(hit, np.asarray(scene.camera.eye) + distances * directions, 0)

    def normals(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Return unit normals (N, 3), turned towards the viewer on two-sided shapes; 0 on a miss."""
        normals = np.zeros((len(objects), 3))
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            if here.any():
                outward = self.outward_normals(scene, index, positions[here], objects[here, 1])
                away = dot(outward, directions[here]) > 0
                normals[here] = np.where(away[:, np.newaxis] & shape.two_sided, -outward, outward)
        return normals

    def outward_normals(self, scene: Scene, index: int, positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Return a shape's unit normals (N, 3), never turned towards the viewer."""
        return surface_of(scene.shapes[index]).outward(positions, faces)

    def planes(self, scene: Scene, rows: Rows) -> np.ndarray:
        """Return the normals (N, 3), of any length, of the planes of the hit faces, to the side of the normal.

        A triangle's normal is computed in object space, and its plane from corners that are rounded to float32: a light
        between the horizons of the two is above one and below the other.
        """
        objects, planes = rows[Stage.OBJECT], np.array(rows[Stage.NORMAL])
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            if here.any():
                normals = surface_of(shape).planes(rows[Stage.POSITION][here], objects[here, 1])
                away = dot(normals, planes[here]) < 0
                planes[here] = np.where(away[:, np.newaxis], -normals, normals)
        return planes

    def shadow_starts(self, scene: Scene, rows: Rows, lift: np.ndarray | float) -> np.ndarray:
        """Return the origins (N, 3) [m] of shadow rays: `lift` [m] above the hit along the normal."""
        if not np.any(lift):
            return rows[Stage.POSITION]
        return rows[Stage.POSITION] + np.reshape(lift, (-1, 1)) * rows[Stage.NORMAL]

    def above_horizon(self, scene: Scene, light: PointLight, starts: np.ndarray, rows: Rows) -> np.ndarray:
        """Return whether dot(N, L) > 0, (N,), at the hit or at the start of the shadow ray."""
        source, normals = np.asarray(light.position, dtype=np.float64), rows[Stage.NORMAL]
        above = dot(normals, source - starts) > 0
        if starts is not rows[Stage.POSITION]:
            above |= dot(normals, source - rows[Stage.POSITION]) > 0
        return above

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        """Return whether shape `index` is strictly between the light and points on the given objects, (N,).

        The hit surface is divided out by algebra, never by an epsilon: a flat face cannot block itself, and an
        ellipsoid or a cube blocks itself according to the light's side. So there is no acne to suppress, and a point
        that is a rounding error off its surface is treated as a point of it. A surface that coincides with the hit one
        also contains the point, and so does not meet the open segment there.
        """
        surface, source, segments = surface_of(scene.shapes[index]), rays.source, rays.segments
        own, ends = rays.objects[:, 0] == index, ends_of(np.asarray(scene.camera.eye), rays.starts)
        low, high = (np.broadcast_to(share, len(own)) for share in rays.between)
        blocked = np.zeros(len(own), dtype=bool)
        blocked[~own] = surface.blocks(source, segments[~own], ends[~own], (low[~own], high[~own]))
        if own.any():
            blocked[own] = surface.blocks_own(source, segments[own], ends[own], rays.objects[own, 1])
        return blocked

    def visibility(self, scene: Scene, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return 1 per light above the horizon and unobstructed, else 0, shape (N, lights); 0 on a miss."""
        objects, freedom = rows[Stage.OBJECT], freedom or Freedom()
        starts = self.shadow_starts(scene, rows, freedom.lift)
        answer = np.zeros((len(objects), len(scene.lights)))
        planes = self.planes(scene, rows) if np.any(freedom.plane) else None
        for column, light in enumerate(scene.lights):
            above = (objects[:, 0] >= 0) & self.above_horizon(scene, light, starts, rows)
            if planes is not None:
                below = dot(planes, np.asarray(light.position) - rows[Stage.POSITION]) <= 0
                above &= ~(below & freedom.plane)
            candidates = np.flatnonzero(above)
            free = np.ones(len(candidates), dtype=bool)
            end = 1.0
            if np.any(freedom.blind):
                away = length(starts[candidates] - np.asarray(light.position))
                with np.errstate(all="ignore"):
                    end = 1 - np.broadcast_to(freedom.blind, len(objects))[candidates] / away
            for index in range(len(scene.shapes)):
                left = np.flatnonzero(free)
                between = freedom.light, end if np.ndim(end) == 0 else np.asarray(end)[left]
                rays = RaysToLight(light, objects[candidates[left]], starts[candidates[left]], between)
                free[left] = ~self.blocked(scene, index, rays)
            answer[candidates[free], column] = 1
        return answer

    def irradiance_of(self, scene: Scene, light: PointLight, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return E [W/m^2] (N, 3) that a light adds where it is visible (RAD-1, RAD-2, RAD-3).

        Source: an isotropic source of flux Phi sends Phi / (4 pi) into a unit solid angle, and a surface element at
        distance r whose normal is turned by theta fills cos(theta) / r^2 of it.
        """
        arriving = np.zeros((len(positions), 3))
        with np.errstate(all="ignore"):
            offset = np.asarray(light.position) - positions
            # Scaled by its greatest component, since r^2 could overflow or underflow.
            size = np.abs(offset).max(axis=1)
            scaled = offset / size[:, np.newaxis]
            stretch = length(scaled)
            cosine = np.clip(dot(normals, scaled) / stretch, 0, None)
            for channel in range(3):
                if scene.shading == "simplified":
                    part = light.flux[channel] * np.minimum(cosine, 1)
                else:
                    part = light.flux[channel] / (4 * np.pi) * cosine / stretch / stretch / size / size
                arriving[:, channel] = np.where(cosine > 0, part, 0)
        return arriving

    def irradiance(self, scene: Scene, objects: np.ndarray, shares: np.ndarray, visible: np.ndarray) -> np.ndarray:
        """Return E [W/m^2] (N, 3): the sum of the visible lights' shares (N, lights, 3); 0 on a miss."""
        total = np.zeros((len(objects), 3))
        for column in range(len(scene.lights)):
            total += np.where(visible[:, column : column + 1] > 0, shares[:, column], 0)
        return np.where(objects[:, :1] >= 0, total, 0)

    def albedo(self, scene: Scene, objects: np.ndarray) -> np.ndarray:
        """Return the albedo (N, 3) of each object, 0 on a miss."""
        # The renderer under test may write numbers of shapes that do not exist: nothing is lit there, as on a miss.
        is_shape = (objects[:, 0] >= 0) & (objects[:, 0] < len(scene.shapes))
        albedos = np.array([*(shape.albedo for shape in scene.shapes), (0.0, 0.0, 0.0)])
        return albedos[np.where(is_shape, objects[:, 0], -1).astype(int)]

    def exitance(self, scene: Scene, objects: np.ndarray, arriving: np.ndarray) -> np.ndarray:
        """Return M = albedo E [W/m^2] (N, 3)."""
        albedo = self.albedo(scene, objects)
        with np.errstate(all="ignore"):
            # A black surface under an infinite irradiance is black, not NaN.
            return np.where(albedo == 0, 0, albedo * arriving)

    def facing(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return whether each hit shows its lit side, (N,): a one-sided surface has no radiance seen from behind.

        Two-sided surfaces need no special case: their normals are already turned towards the viewer.
        """
        return (objects[:, 0] >= 0) & (dot(normals, directions) < 0)

    def leaving(self, scene: Scene, exitance: np.ndarray) -> np.ndarray:
        """Return L [W/(m^2 sr)] (N, 3) that leaves a lit side (RAD-4)."""
        return exitance * (1.0 if scene.shading == "simplified" else 1 / math.pi)

    def radiance(self, scene: Scene, rows: Rows) -> np.ndarray:
        """Return L [W/(m^2 sr)] towards the camera (N, 3)."""
        visible = self.facing(scene, rows[Stage.RAY], rows[Stage.OBJECT], rows[Stage.NORMAL])
        return np.where(visible[:, np.newaxis], self.leaving(scene, rows[Stage.EXITANCE]), 0)

    def image(self, scene: Scene, stage: Stage, values: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the written values of a stage with values (N, channels) at the image points (N, 2) [px]."""
        return values

    # From the steps to stages.

    def continued(self, scene: Scene, stage: Stage, rows: Rows, freedom: Freedom | None = None) -> np.ndarray:
        """Return a stage (N, channels) from the rows of the stages that it reads; `continue_from` lists them."""
        return self._next[stage](scene, rows, freedom)

    @property
    def _next(self) -> dict[Stage, Callable[[Scene, Rows, Freedom | None], np.ndarray]]:
        ray, thing, distance, position, normal, visible, arriving, leaving = IMAGE_STAGES[:-1]

        def shares(scene: Scene, rows: Rows) -> np.ndarray:
            irradiances = [self.irradiance_of(scene, light, rows[position], rows[normal]) for light in scene.lights]
            return np.stack(irradiances, axis=1) if irradiances else np.zeros((len(rows[position]), 0, 3))

        return {
            thing: lambda scene, rows, freedom: self.nearest(scene, rows[ray], freedom).objects,
            distance: lambda scene, rows, freedom: self.distances(scene, rows[ray], rows[thing], freedom)[
                :, np.newaxis
            ],
            position: lambda scene, rows, _: self.positions(scene, rows[ray], rows[thing], rows[distance]),
            normal: lambda scene, rows, _: self.normals(scene, rows[ray], rows[thing], rows[position]),
            visible: self.visibility,
            arriving: lambda scene, rows, _: self.irradiance(scene, rows[thing], shares(scene, rows), rows[visible]),
            leaving: lambda scene, rows, _: self.exitance(scene, rows[thing], rows[arriving]),
            Stage.RADIANCE: lambda scene, rows, _: self.radiance(scene, rows),
        }

    def samples(
        self, scene: Scene, points: np.ndarray, last: Stage, freedom: Freedom | None = None, *, by_light: bool = False
    ) -> Samples:
        """Return every image stage up to `last` at image points (N, 2) [px]; `by_light` also each light's share."""
        rendered, image_points = self.scene(scene), np.asarray(points, dtype=np.float64)
        rows = {Stage.RAY: self.rays(rendered, self.image_points(rendered, image_points))}
        pieces, shares = np.zeros(len(image_points), dtype=int), None
        if last is not Stage.RAY:
            # Object and distance are one search.
            hits = self.nearest(rendered, rows[Stage.RAY], freedom)
            rows[Stage.OBJECT], rows[Stage.DISTANCE], pieces = hits.objects, hits.distances[:, np.newaxis], hits.pieces
            following = self._next
            order = list(following)
            for stage in order[2 : order.index(last) + 1]:
                if stage is Stage.NORMAL and freedom is not None and np.any(freedom.slide):
                    off = np.reshape(freedom.slide, (-1, 1)) * rows[Stage.RAY]
                    about = rows | {Stage.POSITION: rows[Stage.POSITION] + off}
                    rows[stage], pieces = following[stage](rendered, about, freedom), self.pieces_at(rendered, about)
                    continue
                rows[stage] = following[stage](rendered, rows, freedom)
        factors: dict[Stage, np.ndarray] = {}
        ambient: dict[Stage, np.ndarray] = {}
        if by_light and Stage.VISIBILITY in rows:
            position, normal = rows[Stage.POSITION], rows[Stage.NORMAL]
            irradiances = [self.irradiance_of(rendered, light, position, normal) for light in rendered.lights]
            shares = np.stack(irradiances, axis=1) if irradiances else np.zeros((len(image_points), 0, 3))
            factors, ambient = self._linear(rendered, rows)
        written = {stage: self.image(rendered, stage, values, image_points) for stage, values in rows.items()}
        return Samples(rows=written, pieces=pieces, shares=shares, factors=factors, ambient=ambient)

    def _linear(self, scene: Scene, rows: Rows) -> tuple[dict[Stage, np.ndarray], dict[Stage, np.ndarray]]:
        """Return for each stage of light its factor of irradiance (N, 3), and its value without irradiance."""
        factors, ambient = {}, {}
        dark, bright = np.zeros((len(rows[Stage.OBJECT]), 3)), np.ones((len(rows[Stage.OBJECT]), 3))
        for arriving, into in ((dark, ambient), (bright, factors)):
            earlier = dict(rows) | {Stage.IRRADIANCE: arriving}
            earlier[Stage.EXITANCE] = self.exitance(scene, earlier[Stage.OBJECT], arriving)
            into |= {stage: earlier[stage] for stage in (Stage.IRRADIANCE, Stage.EXITANCE)}
            into[Stage.RADIANCE] = self.radiance(scene, earlier)
        return {stage: bright - ambient[stage] for stage, bright in factors.items()}, ambient

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        Raises:
            ValueError: samples < 1, or samples > 1 for a stage other than radiance.

        """
        if samples < 1 or (samples > 1 and set(stages) != {Stage.RADIANCE}):
            raise ValueError(f"samples must be 1, or more for radiance alone, got {samples} for {sorted(stages)}")
        camera = scene.camera
        centers = pixel_centers(camera)
        answers: StageImages = {}
        if Stage.CAMERA in stages:
            answers[Stage.CAMERA] = self.camera_matrices(self.scene(scene).camera)
        if samples == 1:
            images = self.at(scene, [stage for stage in stages if stage is not Stage.CAMERA], centers)
        else:
            offsets = (np.arange(samples) + 0.5) / samples - 0.5
            # A sample's offset is a share of its own part of the pixel.
            centers = centers - (1 - 1 / samples) * np.asarray(camera.sample_offset)
            total = np.zeros((len(centers), 3))
            for down in offsets:
                points = centers + np.stack(np.broadcast_arrays(offsets, down), axis=1)[:, np.newaxis]
                values = self.at(scene, [Stage.RADIANCE], points.reshape(-1, 2))[Stage.RADIANCE]
                total += values.reshape(samples, -1, 3).sum(axis=0)
            images = {Stage.RADIANCE: total / samples**2}
        for stage, rows in images.items():
            answers[stage] = rows.reshape(camera.height, camera.width, rows.shape[1])
        return answers

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> StageImages:
        """Answer image stages at image points (N, 2) = (px, py) [px]; each answer has shape (N, channels).

        Raises:
            ValueError: the camera stage, which is no image.

        """
        if Stage.CAMERA in stages:
            raise ValueError("the camera stage has no value at an image point")
        if not stages:
            return {}
        rows = self.samples(scene, points, max(stages, key=IMAGE_STAGES.index)).rows
        return {stage: rows[stage] for stage in IMAGE_STAGES if stage in stages}

    def continue_from(self, scene: Scene, stage: Stage, earlier: StageImages) -> np.ndarray:
        """Return an image stage computed from the `earlier` ones, by exact mathematics on their numbers.

        `earlier` has (height, width, channels) arrays of the stages that the new stage depends on:

            ray <- nothing             object <- ray                    distance <- ray, object
            position <- ray, object, distance                           normal <- ray, object, position
            visibility <- object, position, normal                      irradiance <- those and visibility
            exitance <- object, irradiance                              radiance <- ray, object, normal, exitance

        Directions are used unchanged, with any length: t is in units of it. Positions are assumed to be on the surface
        of their object, even if rounding moved them off it.

        Raises:
            ValueError: the camera stage, which continues from nothing and is no image.

        """
        camera = scene.camera
        if stage is Stage.CAMERA:
            raise ValueError("the camera stage continues from nothing; ask render")
        rendered, points = self.scene(scene), pixel_centers(camera)
        if stage is Stage.RAY:
            rows = self.rays(rendered, self.image_points(rendered, points))
        else:
            flat = {
                name: np.asarray(image, dtype=np.float64).reshape(camera.height * camera.width, np.shape(image)[-1])
                for name, image in earlier.items()
                if name is not Stage.CAMERA
            }
            rows = self.continued(rendered, stage, flat)
        return self.image(rendered, stage, rows, points).reshape(camera.height, camera.width, rows.shape[1])

    def pieces_at(self, scene: Scene, rows: Rows) -> np.ndarray:
        """Return the smooth piece (N,) of the object at each position, 0 on a miss."""
        objects, pieces = rows[Stage.OBJECT], np.zeros(len(rows[Stage.OBJECT]), dtype=int)
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            if here.any():
                arguments = rows[Stage.POSITION][here], rows[Stage.RAY][here], objects[here, 1]
                pieces[here] = np.nan_to_num(surface_of(shape).pieces_at(*arguments))
        return pieces

    def known(self, scene: Scene, objects: np.ndarray) -> np.ndarray:
        """Return the mask (N,) of the (shape, face) (N, 2) in the scene; a renderer's may be any numbers, or NaN."""
        exists = np.zeros(len(objects), dtype=bool)
        for index, shape in enumerate(scene.shapes):
            face = objects[:, 1]
            exists |= (
                (objects[:, 0] == index) & (face >= 0) & (face < surface_of(shape).faces) & (face == np.floor(face))
            )
        return exists

    def image_points_of(self, scene: Scene, objects: np.ndarray) -> np.ndarray:
        """Return the image point (N, 2) [px] of the middle of each (shape, face); NaN if it is not before the eye."""
        places = np.full((len(objects), 3), np.nan)
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            if here.any():
                places[here] = surface_of(shape).middle(objects[here, 1])
        return view_of(scene.camera).image_points(places)


def _put(hits: Hits, where: np.ndarray, index: int, crossing: Crossing) -> None:
    hits.distances[where], hits.pieces[where] = crossing.distance[where], crossing.piece[where]
    hits.objects[where, 0], hits.objects[where, 1] = index, crossing.face[where]
