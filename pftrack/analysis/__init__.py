"""Questions about finished runs: why the target was lost, what would have saved it, which noises fit, how good it was.

- `diagnosis`: the cause of a loss; `counterfactuals`: what would have saved the run, and the
  `alternatives` that are tried;
- `fitting`: noises and sharpnesses that explain what was seen, by `search`;
- `evaluation`: scores on public clips; `failures`: named failures beside their cures;
- `explanation`: the answer in words.
"""
