"""Code shared by several experiments: beliefs, reports and signals of trackers, drawings, the probability of a loss.

A tracker is a pair of pure functions, `start(target, frame, parameters, rng) -> TrackState` and `step(state, frame,
parameters, rng) -> TrackState`. They keep no hidden state, so a run can rewind and branch at no cost. All trackers of
an experiment accept each other's states, so a run can switch trackers.

A state has few attributes (`TrackState`): estimate, standard deviations, evidence, size and arrays. A tracker declares
further values, such as particles, hypotheses or mixing ratios, as series and measures of its states.

- `sampling`: the loop that draws by prediction and by observation (Bando 2007, ch. 3), for the ball and the window;
- `pose`: the methods of Bando 2007, ch. 4 for the pose of a solid, for the prism (points) and the head (templates);
- `filtered`: models joined with filters, and innovations of Kalman filters;
- `reports`: series, parameters and a state that several families declare alike; `sketch`: pieces of drawings;
- `loss_probability`: signals of a loss in a run's numbers, and its probability.
"""
