"""The probability that a tracker has lost its target, told from what it knows itself.

A tracker goes on whether it follows its target or something else. What it computes on the way tells the two apart,
more or less: how well the picture agrees with what was expected, how wide the belief is, how many particles carry it,
whether the estimate jumps. Each number means something only beside what it was before. A logistic regression weighs
them; it is fitted on scenes that were drawn at random, frozen, and judged on others (`pftrack reproduce loss`), and
only where it says what is true it is declared. On recordings it is not calibrated, and not told.

- `signals`: what is read of a frame, by roles;
- `features`: the same beside what it was before;
- `logistic`: the regression;
- `model`: signals, features and regression of a tracker, followed frame by frame;
- `declaration`: what an experiment declares, and the file that it is kept in;
- `scenes`: those that it is fitted and judged on;
- `scores`: how good probabilities are.
"""
