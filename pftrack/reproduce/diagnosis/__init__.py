"""How often the diagnosis is right about runs that were lost by what was put there, half of them kept aside."""
