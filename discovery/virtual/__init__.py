"""The virtual machine: recordings with known physics, and concealed cases from a finer plant.

`machine` numbers, `effects` what can be switched on, `physics` laws, `plant` the kernel, `cycles` what the machine is told
to do, `measurement` and `faults` the log, `record` files, `nmv5000` the campaign in the repository; `fine`, `laws`, `world`
and `cases` are the plant and the concealed cases of `discovery challenge`.
"""
