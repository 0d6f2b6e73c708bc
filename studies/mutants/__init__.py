"""Changes of an operator, comparison or number at random places of tasks/: does a test fail?"""
