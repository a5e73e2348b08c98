from hypothesis import settings

# The first example compiles kernels, and time is measured in benchmarks/, never here.
settings.register_profile("suite", deadline=None)
settings.load_profile("suite")
