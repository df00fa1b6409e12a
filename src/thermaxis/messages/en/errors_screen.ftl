### Errors of the screen

error-no_screen = The configuration has no table [screen].
    .remedy = Add [screen].
error-screen_cannot_listen = The screen cannot listen: { $cause }.
    .remedy = Take another port, or end the program that has it.
