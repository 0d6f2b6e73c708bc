"""A double-track car with physics of its own, against which `musync close-loop` is judged.

Nothing here that makes campaigns imports anything of muSync: no equation and no line of code is shared with the model.
"""
