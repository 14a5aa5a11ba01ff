"""The virtual machine: recordings with known physics, and concealed cases from a finer plant.

`machine`: every number. `effects`, `physics`: what can be switched on, and the laws. `plant`: the kernel.
`cycles`: the commands of the machine. `measurement`, `faults`: the log. `record`, `nmv5000`: files, the
campaign of the repository. `fine`, `chains`: the finer machine; `laws`, `outside`, `world`: what can be
concealed in it; `concealing`, `cases`, `casefiles`: what is.
"""
