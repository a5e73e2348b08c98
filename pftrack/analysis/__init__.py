"""Analysis of finished runs: why the target was lost, what would have saved it, which noises fit, and scores.

- `diagnosis`: the cause of a loss; `counterfactuals`: what would have saved the run, and the tested `alternatives`;
- `fitting`: noises and sharpnesses that explain the observations, by `search`;
- `evaluation`: scores on public clips; `failures`: named failures and their cures;
- `explanation`: the answer in words.
"""
