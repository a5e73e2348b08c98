"""What several experiments share: beliefs, reports and signals of trackers, drawings, the probability of a loss.

A tracker is a pair of pure functions, `start(target, frame, parameters, rng) -> TrackState` and `step(state, frame,
parameters, rng) -> TrackState`. Nothing is hidden in it, so a run can rewind and branch at no cost, and all trackers of
an experiment understand each other's states, so that one may take over from another in mid-run.

A state offers little (`TrackState`): estimate, standard deviations, evidence, size and arrays. What a tracker has
beyond that, such as particles, hypotheses or mixing ratios, it declares as series and measures of its states.

- `sampling`: the loop that draws by prediction and by observation (Bando 2007, ch. 3), for the ball and the window;
- `pose`: the methods of Bando 2007, ch. 4 for the pose of a solid, for the prism (points) and the head (templates);
- `beliefs`: the tracker of recorded beliefs, what a filter in a file is told, and what updates of a Kalman filter tell;
- `reports`: series, parameters and a state that several families declare alike; `sketch`: pieces of drawings;
- `signals`, `loss_probability`: what a run's numbers say of a loss, and how probable it is.
"""
