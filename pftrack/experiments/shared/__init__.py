"""Trackers: filters joined with likelihoods into something that follows a target through frames.

A tracker is a pair of pure functions, `start(target, frame, parameters, rng) -> TrackState` and
`step(state, frame, parameters, rng) -> TrackState`. Nothing is hidden in it, so a run can rewind and branch at no cost,
and all trackers of an experiment understand each other's states, so that one may take over from another in mid-run.

A state offers little (`TrackState`): estimate, standard deviations, evidence, size and arrays. What a tracker has
beyond that, such as particles, hypotheses or mixing ratios, it declares as series and measures of its states.

- `ball`: the switching filters of Bando 2007, ch. 3, and what they are compared with;
- `pose`: the methods of Bando 2007, ch. 4 for the pose of a solid, for `prism` (points) and `head` (templates);
- `signal`: the Kalman and the particle filter of Bando 2007, ch. 2;
- `sampling`: the loop that draws by prediction and by observation, which `ball` shares with others;
- `innovation`: what the update of a Kalman filter is made of, for people who look into a frame;
- `reports`, `parameters`: the series and the parameters that several families declare alike.
"""
