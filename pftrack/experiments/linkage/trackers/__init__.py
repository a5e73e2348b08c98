"""Trackers of a chain of three links before one camera: lengths and pose at once, from where its joints are seen.

Depth is not seen, so that image positions alone determine neither; what is known beforehand of joints, motion and
lengths has to. Two families use it in two ways (Shimada 1997):

- Gaussians, which it cuts (`chain`): `gaussians` steps a beam of extended Kalman filters, one for each side on which a
  link may lie (`linearised`), or one unscented filter; `particles` draws instead (`sampled`);
- sets, which it bounds (`regions`): `sets` steps ellipsoids and guides that the truth never leaves.

All believe in one `state`, so that they take over from one another (`handover`), and read one set of `parameters`.
`reports` is what all of them report, `inspection` what they tell people who look into a frame; `step` lists them.
"""

__all__: list[str] = []
